function z({texture:h,clampU:t,clampV:s,factor:r,blends:e,cutoff:i,twoSided:o,octree:n,relief:a}){return[h,t,s,r,e,i,o,n,a].join()}function*U(h){let t=new Map;for(let d of h){let E=z(d),w=t.get(E);w?w.push(d):t.set(E,[d])}let s=h.reduce((d,{positions:E})=>d+E.length/3,0),r=h.reduce((d,{indices:E})=>d+E.length,0),e=h.some(({colors:d})=>d),i=e?6:5,o=new Float32Array(i*s),n=new Uint8Array(o.buffer),a=s>65535?new Uint32Array(r):new Uint16Array(r),c=[],u=0,f=0;for(let d of t.values()){let E=f;for(let{positions:p,uvs:v,colors:y,indices:T}of d){yield;for(let m=0;m<T.length;m++)m%16384===16383&&(yield),a[f++]=u+T[m];for(let m=0;m<p.length/3;m++,u++){m%16384===16383&&(yield);for(let l=0;l<3;l++)o[i*u+l]=p[3*m+l];for(let l=0;e&&l<4;l++)n[24*u+20+l]=y?255*F(y[4*m+l]/65535)+.5:255;v&&(o[i*u+3]=v[2*m],o[i*u+4]=v[2*m+1])}}let[w]=d,A=[...w.factor.slice(0,3).map(F),w.factor[3]];for(let p=E;p<f;p+=6144){let v=a.subarray(p,Math.min(p+6144,f)),y=Y(v,o,i);c.push({look:w,first:p*a.BYTES_PER_ELEMENT,count:v.length,color:A,...y}),yield}}return{data:o,painted:e,index:a,batches:c}}function Y(h,t,s){let r=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let i=0;i<h.length;i++)for(let o=0,n=s*h[i];o<3;o++,n++)t[n]<r[o]&&(r[o]=t[n]),t[n]>e[o]&&(e[o]=t[n]);return{low:r,high:e}}var R=class{constructor(t,{data:s,painted:r,index:e,batches:i},o){this.gl=t,this.shapes=o,this.batches=i,this.bytes=s.byteLength+e.byteLength,this.type=e instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,s,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,e,t.STATIC_DRAW);let n=r?24:20;t.enableVertexAttribArray(0),t.vertexAttribPointer(0,3,t.FLOAT,!1,n,0),t.enableVertexAttribArray(1),t.vertexAttribPointer(1,2,t.FLOAT,!1,n,12),t.vertexAttrib4f(2,1,1,1,1),r&&(t.enableVertexAttribArray(2),t.vertexAttribPointer(2,4,t.UNSIGNED_BYTE,!0,n,20)),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}};function F(h){return h<=.0031308?12.92*h:1.055*h**(1/2.4)-.055}var I=(h="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${h}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,j=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,W=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${j}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=0.25+0.75*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
sampled=vec4(1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,C=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,$=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${C}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,q=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${C}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,B={surface:[I(),W],item:[I(),$],placeholder:[I(),q]};function L(h,t,s=B[t]){let r=h.createProgram(),e=[h.VERTEX_SHADER,h.FRAGMENT_SHADER];if(s.forEach((n,a)=>{let c=h.createShader(e[a]);h.shaderSource(c,n),h.compileShader(c),h.attachShader(r,c),h.deleteShader(c)}),h.linkProgram(r),!h.getProgramParameter(r,h.LINK_STATUS)&&!h.isContextLost())throw new Error(`${t}: ${h.getProgramInfoLog(r)}`);let i={},o=h.isContextLost()?0:h.getProgramParameter(r,h.ACTIVE_UNIFORMS);for(let n=0;n<o;n++){let a=h.getActiveUniform(r,n)?.name??"";i[a]=h.getUniformLocation(r,a)}return{program:r,at:i}}function P(h,{program:t,at:s},r){h.useProgram(t),h.uniform3fv(s.eye,r.eye),h.uniformMatrix3fv(s.turn,!1,r.turn),h.uniform4fv(s.lens,r.lens)}var O=[.16,.17,.19,1],_=class{cells=new Map;#t=new Map;constructor(t,s,r){this.gl=t,this.memory=s,this.means=r.map(e=>e.map(i=>i/255)),this.surface=L(t,"surface"),this.statues=null}add(t,s,r){let e=this.#t.get(t)??{shapes:s,steps:U(s)};this.#t.set(t,e);let{steps:i}=e,o=i.next();for(;!o.done;){if(r())return!1;o=i.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new R(this.gl,o.value,e.shapes)),!0}keep(t){for(let[s,r]of this.cells)t.has(s)||(r.delete(),this.cells.delete(s));for(let s of this.#t.keys())t.has(s)||this.#t.delete(s)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:s}of this.cells.values())t+=s;return t}draw(t,s,r){let{gl:e,surface:i}=this;e.clearColor(O[0],O[1],O[2],1),e.depthMask(!0),e.clear(e.COLOR_BUFFER_BIT|e.DEPTH_BUFFER_BIT),e.enable(e.DEPTH_TEST),e.disable(e.BLEND),P(e,i,t);let o=!1,n=[],a=[];for(let{buffers:c,batches:u}of s){e.bindVertexArray(c.vertexArray);for(let f of u)f.look.blends?n.push({buffers:c,batch:f,far:J(t.eye,f)}):this.statues?.has(f.look)?a.push({buffers:c,batch:f}):o=this.#e(c,f,r)||o}if(a.length){let c=(u,f)=>this.#s(u,f,r);o=this.statues?.draw(t,a,c,r)||o,e.useProgram(i.program)}if(n.length){e.enable(e.BLEND),e.blendFuncSeparate(e.SRC_ALPHA,e.ONE_MINUS_SRC_ALPHA,e.ONE,e.ONE_MINUS_SRC_ALPHA),e.depthMask(!1);for(let{buffers:c,batch:u}of n.sort((f,d)=>d.far-f.far))e.bindVertexArray(c.vertexArray),o=this.#e(c,u,r)||o;e.depthMask(!0)}return e.bindVertexArray(null),o}#e(t,s,r){let e=this.#s(this.surface.at,s,r);return t.draw(s),e}#s(t,s,r){let{gl:e}=this,{texture:i,clampU:o,clampV:n,cutoff:a,twoSided:c}=s.look;(c?e.disable:e.enable).call(e,e.CULL_FACE),e.uniform4fv(t.color,s.color),e.uniform1f(t.cutoff,a),e.uniform1i(t.textured,+(i>=0));let u=i<0?null:this.memory.of(i);return e.uniform1i(t.channels,u?.channels??0),i>=0&&e.uniform3fv(t.mean,this.means[i]),u?.bind(o,n,r)??!1}};function J(h,{low:t,high:s}){return Math.hypot(...h.map((r,e)=>(t[e]+s[e])/2-r))}function G(h,t,s){if(!s)return h;let r=new Uint8ClampedArray(h),e=t-+(t>1);for(let i=0;i<r.length;i+=t)for(let o=i;o<i+e;o++)r[o]+=s;return new Uint8Array(r.buffer)}var Q=262144,Z=.3;function H(h,t){return t===1?{inside:h.R8,outside:h.RED}:t===2?{inside:h.RG8,outside:h.RG}:{inside:h.RGBA8,outside:h.RGBA}}var S=class{#t=0;#e=0;#s=-1;constructor(t,s,r){this.gl=t,this.sizes=s,this.channels=r,this.texture=t.createTexture(),this.bytes=s.reduce((o,{width:n,height:a})=>o+n*a*r,0);let{width:e,height:i}=s[s.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,s.length,H(t,r).inside,e,i),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,s,r,e){let{gl:i,channels:o}=this,{width:n,height:a}=this.sizes[t],c=Math.min(a-r,Math.max(1,Math.floor(Q/(n*o)))),u=s.subarray(r*n*o,(r+c)*n*o);return i.bindTexture(i.TEXTURE_2D,this.texture),i.pixelStorei(i.UNPACK_ALIGNMENT,1),i.texSubImage2D(i.TEXTURE_2D,this.levels-1-t,0,r,n,c,H(i,o).outside,i.UNSIGNED_BYTE,G(u,o,e)),r+c}fadeIn(t,s){this.#t=t,this.#e=s}bind(t,s,r){let{gl:e}=this,i=+t+2*+s;if(e.bindTexture(e.TEXTURE_2D,this.texture),i!==this.#s){let[n,a]=[t,s].map(c=>c?e.CLAMP_TO_EDGE:e.REPEAT);e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_S,n),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_T,a),this.#s=i}if(!this.#t)return!1;let o=this.#t*Math.max(0,1-(r-this.#e)/Z);return e.texParameterf(e.TEXTURE_2D,e.TEXTURE_MIN_LOD,o>0?o:-1e3),o===0&&(this.#t=0),o>0}delete(){this.gl.deleteTexture(this.texture)}};var tt=3,et=6,k=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,s){this.texture=t,this.to=s,this.inside=!1}},N=class{#t;#e=new Map;#s=new Int32Array(0);#c=new Float64Array(0);#i;#r;constructor(t,s,r){this.gl=t,this.rows=s,this.decode=r,this.#t=s.map(()=>null),this.held=new Int32Array(s.length),this.loss=new Float64Array(s.length),this.#i=new Float64Array(s.length),this.#r=new Int32Array(s.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,s,r){this.#s=t,this.#i=r,this.#r.fill(0),this.#c=s;for(let n=0;n<t.length;n++)t[n]===0&&this.held[n]&&this.#h(n);let e=[...t.keys()].filter(n=>this.held[n]>t[n]);e.sort((n,a)=>s[n]-s[a]);let i=[...this.#e.values()].some(({storage:n,inside:a})=>n&&!a),o=Math.min(...e.map(n=>this.#l(n,t[n])));for(let n of e){if(this.bytes<=this.budget&&(i||this.bytes+o<=this.budget))break;this.#h(n)}this.#o()}hold(){this.#s=this.held.map((t,s)=>Math.max(t,Math.min(this.#s[s]??0,this.#r[s]))),this.#i=this.loss.slice()}resume(){this.#o()}#u(t,s){let r=-1;for(let e=0;e<this.rows.length;e++)t(e)&&(r<0||s(e)>s(r))&&(r=e);return r}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#i[t]<this.loss[t]}#a(t){let s=this.held[t],r=this.#s[t];return r<s?2:s===0?1:r>s?0:-1}#o(){let{held:t}=this,s=this.#s,r=this.#c;for(;;){let e=[...this.#e.values()];if(e.filter(({images:a})=>!a).length>=tt)return;let i=e.length<et,o=this.#u(a=>s[a]>0&&!this.#e.has(a)&&(s[a]<t[a]||i&&(s[a]>t[a]||this.#d(a))),a=>r[a]+this.#a(a));if(o<0)return;let n=new k(o,s[o]);this.#e.set(o,n),this.decode(o,s[o]).then(({images:a,loss:c})=>{Object.assign(n,{images:a,loss:c}),this.#o()},()=>this.#n(n))}}#n(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#f(t.storage),this.#e.delete(t.texture))}#h(t){let s=this.#t[t];s&&this.#f(s),this.#t[t]=null,this.held[t]=0}pump(t,s){let r=!1,e=[...this.#e.values()];e.sort((i,o)=>this.#a(o.texture)-this.#a(i.texture));for(let i of e){for(;!s()&&this.#m(i,t);)r=!0;if(s())break}return r&&this.#o(),r}#m(t,s){let{texture:r,to:e,images:i,loss:o}=t,n=this.held[r],{offsets:a}=this.rows[r];if(!i||this.#e.get(r)!==t)return!1;let c=this.#s[r],u=e===n&&o<this.loss[r];if(c===0||e>c||e<=n&&c>=n&&!u)return this.#n(t),!1;t.storage||(t.inside=u,t.storage=u?this.#t[r]:this.#p(r,e));let{storage:f}=t;if(!f||t.inside&&f!==this.#t[r])return f&&this.#n(t),!1;let{level:d,row:E}=t,{data:w,height:A}=i[d];return t.row=f.upload(d,w,E,a[d]),t.row>=A&&(t.row=0,t.level++),t.level<e||(this.#e.delete(r),this.loss[r]=o,t.inside)||(this.#h(r),this.#t[r]=f,this.held[r]=e,this.fades&&n>0&&e>n&&f.fadeIn(e-n,s)),!0}#p(t,s){let{sizes:r,channels:e}=this.rows[t],i=this.#l(t,s),o=s<this.held[t]?0:this.#y();return this.bytes+i+o>this.budget?null:(this.bytes+=i,this.peak=Math.max(this.peak,this.bytes),new S(this.gl,r.slice(0,s),e))}#l(t,s){let{sizes:r,channels:e}=this.rows[t];return r.slice(0,s).reduce((i,o)=>i+o.width*o.height*e,0)}#y(){return this.#s.reduce((t,s,r)=>s<this.held[r]?Math.max(t,this.#l(r,s)):t,0)}#f(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#n(t);for(let t=0;t<this.rows.length;t++)this.#h(t)}lose(){this.#r=this.held.map((t,s)=>Math.max(t,this.#r[s])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};var D=.2,X=8e3,Pt=2**20;function K(h,t){let s=0,r=0;for(let i of t)s+=Math.max(i.left,0),r+=+!i.waits;let e=h.latency+D/2;return r<h.concurrency&&(s===0||8*s<e*h.bandwidth)}var V=class{constructor(t){let{gl:s,rows:r,stream:e,means:i}=t;this.walk=t,this.memory=new N(s,r,(o,n)=>e.decode(o,n)),this.memory.fades=!1,this.renderer=new _(s,this.memory,i),this.renderer.statues=t.renderer?.statues??null}settle(){let{walk:t,memory:s}=this,{client:r,catalogue:e,present:i,estimate:o}=t,{T:n,K:a,levels:c,stored:u,ends:f,previews:{first:d,column:E,loss:w}}=e;if(!i)return!1;let A=new Int32Array(n),p=new Float64Array(n),v=new Float64Array(n),{downloads:y}=r,T=Math.max(X,D*o.bandwidth/8),m=[];for(let l=0;l<n;l++){p[l]=i[l*a+1];let x=c[l],g=-1;for(;x>0&&!(i[l*a+x]>0);)x--;A[l]=Math.min(x,y.reach(l).last),v[l]=y.loss(l,A[l]);for(let b=d[l];x>u[l]&&b<d[l+1];b++)E[b]>=x&&(g<0||w[b]<w[g])&&(g=b);let M=g<0?0:w[g];(s.held[l]<x||x>0&&s.loss[l]>M)&&m.push({texture:l,end:f[l*a+x],preview:g})}s.settle(A,p,v),m.sort((l,x)=>p[x.texture]-p[l.texture]);for(let{texture:l,end:x,preview:g}of m){if(!K(o,y.waiting))break;if(g>=0){y.free("preview",g)&&t.stream.ask(y.ask("preview",g,p[l]));continue}let M=Math.min(x,Math.floor(y.bytes[l]+T));M<=y.bytes[l]||!y.free("texture",l)||t.stream.ask(y.ask("texture",l,p[l],M))}return m.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{V as Comparison};

function z({texture:h,factor:t,blends:e,cutoff:r,twoSided:s,extras:o}){return[h,t,e,r,s,o].join()}function*F(h){let t=new Map;for(let m of h){let y=z(m),w=t.get(y);w?w.push(m):t.set(y,[m])}let e=h.reduce((m,{positions:y})=>m+y.length/3,0),r=h.reduce((m,{indices:y})=>m+y.length,0),s=h.some(({spots:m})=>m),o=h.some(({colors:m})=>m),i=5+2*+s+ +o,n=new Float32Array(i*e),a=new Uint8Array(n.buffer),c=e>65535?new Uint32Array(r):new Uint16Array(r),u=[],f=0,p=0;for(let m of t.values()){let y=p,[w]=m,{factor:v,white:S}=w;for(let{positions:b,uvs:T,colors:l,spots:x,indices:g}of m){yield;for(let E=0;E<g.length;E++)E%16384===16383&&(yield),c[p++]=f+g[E];for(let E=0;E<b.length/3;E++,f++){E%16384===16383&&(yield);for(let d=0;d<3;d++)n[i*f+d]=b[3*E+d];for(let d=0;o&&d<4;d++)a[4*(i*(f+1)-1)+d]=l?255*W(l[4*E+d]/65535,S)+.5:255;for(let d=0;d<2;d++)T&&(n[i*f+3+d]=T[2*E+d]),x&&(n[i*f+5+d]=x[2*E+d])}}let A=S?v:[...v.slice(0,3).map(L),v[3]];for(let b=y;b<p;b+=6144){let T=c.subarray(b,Math.min(b+6144,p)),l=K(T,n,i);u.push({look:w,first:b*c.BYTES_PER_ELEMENT,count:T.length,color:A,...l}),yield}}return{data:n,lit:s,painted:o,index:c,batches:u}}function K(h,t,e){let r=[1/0,1/0,1/0],s=[-1/0,-1/0,-1/0];for(let o=0;o<h.length;o++)for(let i=0,n=e*h[o];i<3;i++,n++)t[n]<r[i]&&(r[i]=t[n]),t[n]>s[i]&&(s[i]=t[n]);return{low:r,high:s}}var R=class{constructor(t,{data:e,lit:r,painted:s,index:o,batches:i},n){this.gl=t,this.shapes=n,this.batches=i,this.bytes=e.byteLength+o.byteLength,this.type=o instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,e,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,o,t.STATIC_DRAW);let a=r?28:20,c=a+4*+s,u=(f,p,m)=>{t.enableVertexAttribArray(f),t.vertexAttribPointer(f,p,p<4?t.FLOAT:t.UNSIGNED_BYTE,p>3,c,m)};u(0,3,0),u(1,2,12),t.vertexAttrib4f(2,1,1,1,1),s&&u(2,4,a),r&&u(3,2,20),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}},W=(h,t)=>t?h**.25:L(h);function L(h){return h<=.0031308?12.92*h:1.055*h**(1/2.4)-.055}function k(h,t,e){let r=h.createProgram(),s=[h.VERTEX_SHADER,h.FRAGMENT_SHADER];if(e.forEach((n,a)=>{let c=h.createShader(s[a]);h.shaderSource(c,n),h.compileShader(c),h.attachShader(r,c),h.deleteShader(c)}),h.linkProgram(r),!h.getProgramParameter(r,h.LINK_STATUS)&&!h.isContextLost())throw new Error(`${t}: ${h.getProgramInfoLog(r)}`);let o={},i=h.isContextLost()?0:h.getProgramParameter(r,h.ACTIVE_UNIFORMS);for(let n=0;n<i;n++){let a=h.getActiveUniform(r,n)?.name??"";o[a]=h.getUniformLocation(r,a)}return{program:r,at:o}}function U(h,{program:t,at:e},r){h.useProgram(t),h.uniform3fv(e.eye,r.eye),h.uniformMatrix3fv(e.turn,!1,r.turn),h.uniform4fv(e.lens,r.lens)}var I=(h="",t="")=>`#version 300 es
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
}`,$=`#version 300 es
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
sampled=vec4(1.0);
float glow=0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,C=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,q=`#version 300 es
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
}`,J=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${C}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,P=[I(),$],lt=[I(),q],ft=[I(),J];var N=class{cells=new Map;#t=new Map;constructor(t,e,r){this.gl=t,this.memory=e,this.means=r.map(({color:s})=>s.map(o=>o/255)),this.light=null,this.surface=this.compile("surface"),this.statues=null}add(t,e,r){let s=this.#t.get(t)??{shapes:e,steps:F(e)};this.#t.set(t,s);let{steps:o}=s,i=o.next();for(;!i.done;){if(r())return!1;i=o.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new R(this.gl,i.value,s.shapes)),!0}keep(t){for(let[e,r]of this.cells)t.has(e)||(r.delete(),this.cells.delete(e));for(let e of this.#t.keys())t.has(e)||this.#t.delete(e)}compile(t,e=P){return k(this.gl,t,this.light?.sources(e)??e)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:e}of this.cells.values())t+=e;return t}draw(t,e,r){let{gl:s,surface:o}=this;s.clearColor(.16,.17,.19,1),s.depthMask(!0),s.clear(s.COLOR_BUFFER_BIT|s.DEPTH_BUFFER_BIT),s.enable(s.DEPTH_TEST),s.disable(s.BLEND),U(s,o,t);let i=!1,n=[],a=[];for(let{buffers:c,batches:u}of e){s.bindVertexArray(c.vertexArray);for(let f of u)f.look.blends?n.push({buffers:c,batch:f,far:Q(t.eye,f)}):this.statues?.has(f.look)?a.push({buffers:c,batch:f}):i=this.#e(c,f,r)||i}if(a.length){let c=(u,f)=>this.#s(u,f,r);i=this.statues?.draw(t,a,c,r)||i,s.useProgram(o.program)}if(this.light?.surround(this,t),n.length){s.enable(s.BLEND),s.blendFuncSeparate(s.SRC_ALPHA,s.ONE_MINUS_SRC_ALPHA,s.ONE,s.ONE_MINUS_SRC_ALPHA),s.depthMask(!1);for(let{buffers:c,batch:u}of n.sort((f,p)=>p.far-f.far))s.bindVertexArray(c.vertexArray),i=this.#e(c,u,r)||i}return s.bindVertexArray(null),i}#e(t,e,r){let s=this.#s(this.surface.at,e,r);return t.draw(e),s}#s(t,e,r){let{gl:s}=this,{texture:o,clampU:i,clampV:n,cutoff:a,twoSided:c}=e.look;(c?s.disable:s.enable).call(s,s.CULL_FACE),s.uniform4fv(t.color,e.color),s.uniform1f(t.cutoff,a),s.uniform1i(t.textured,+(o>=0));let u=o<0?null:this.memory.of(o);s.uniform1i(t.channels,u?.channels??0),o>=0&&s.uniform3fv(t.mean,this.means[o]);let f=this.light?.paint(this,t,e.look,r);return u?.bind(i,n,r)||f}};function Q(h,{low:t,high:e}){return Math.hypot(...h.map((r,s)=>(t[s]+e[s])/2-r))}function B(h,t,e){if(!e)return h;let r=new Uint8ClampedArray(h),s=t-+(t>1);for(let o=0;o<r.length;o+=t)for(let i=o;i<o+s;i++)r[i]+=e;return new Uint8Array(r.buffer)}var Z=262144,tt=.3;function G(h,t){return t===1?{inside:h.R8,outside:h.RED}:t===2?{inside:h.RG8,outside:h.RG}:{inside:h.RGBA8,outside:h.RGBA}}var _=class{#t=0;#e=0;#s=-1;constructor(t,e,r){this.gl=t,this.sizes=e,this.channels=r,this.texture=t.createTexture(),this.bytes=e.reduce((i,{width:n,height:a})=>i+n*a*r,0);let{width:s,height:o}=e[e.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,e.length,G(t,r).inside,s,o),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,e,r,s){let{gl:o,channels:i}=this,{width:n,height:a}=this.sizes[t],c=Math.min(a-r,Math.max(1,Math.floor(Z/(n*i)))),u=e.subarray(r*n*i,(r+c)*n*i);return o.bindTexture(o.TEXTURE_2D,this.texture),o.pixelStorei(o.UNPACK_ALIGNMENT,1),o.texSubImage2D(o.TEXTURE_2D,this.levels-1-t,0,r,n,c,G(o,i).outside,o.UNSIGNED_BYTE,B(u,i,s)),r+c}fadeIn(t,e){this.#t=t,this.#e=e}bind(t,e,r){let{gl:s}=this,o=+t+2*+e;if(s.bindTexture(s.TEXTURE_2D,this.texture),o!==this.#s){let[n,a]=[t,e].map(c=>c?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,n),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,a),this.#s=o}if(!this.#t)return!1;let i=this.#t*Math.max(0,1-(r-this.#e)/tt);return s.texParameterf(s.TEXTURE_2D,s.TEXTURE_MIN_LOD,i>0?i:-1e3),i===0&&(this.#t=0),i>0}delete(){this.gl.deleteTexture(this.texture)}};var et=3,st=6,O=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,e){this.texture=t,this.to=e,this.inside=!1}},M=class{#t;#e=new Map;#s=new Int32Array(0);#l=new Float64Array(0);#o;#r;constructor(t,e,r){this.gl=t,this.rows=e,this.decode=r,this.#t=e.map(()=>null),this.held=new Int32Array(e.length),this.loss=new Float64Array(e.length),this.#o=new Float64Array(e.length),this.#r=new Int32Array(e.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,e,r){this.#s=t,this.#o=r,this.#r.fill(0),this.#l=e;for(let n=0;n<t.length;n++)t[n]===0&&this.held[n]&&this.#h(n);let s=[...t.keys()].filter(n=>this.held[n]>t[n]);s.sort((n,a)=>e[n]-e[a]);let o=[...this.#e.values()].some(({storage:n,inside:a})=>n&&!a),i=Math.min(...s.map(n=>this.#c(n,t[n])));for(let n of s){if(this.bytes<=this.budget&&(o||this.bytes+i<=this.budget))break;this.#h(n)}this.#i()}hold(){this.#s=this.held.map((t,e)=>Math.max(t,Math.min(this.#s[e]??0,this.#r[e]))),this.#o=this.loss.slice()}resume(){this.#i()}#u(t,e){let r=-1;for(let s=0;s<this.rows.length;s++)t(s)&&(r<0||e(s)>e(r))&&(r=s);return r}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#o[t]<this.loss[t]}#a(t){let e=this.held[t],r=this.#s[t];return r<e?2:e===0?1:r>e?0:-1}#i(){let{held:t}=this,e=this.#s,r=this.#l;for(;;){let s=[...this.#e.values()];if(s.filter(({images:a})=>!a).length>=et)return;let o=s.length<st,i=this.#u(a=>e[a]>0&&!this.#e.has(a)&&(e[a]<t[a]||o&&(e[a]>t[a]||this.#d(a))),a=>r[a]+this.#a(a));if(i<0)return;let n=new O(i,e[i]);this.#e.set(i,n),this.decode(i,e[i]).then(({images:a,loss:c})=>{Object.assign(n,{images:a,loss:c}),this.#i()},()=>this.#n(n))}}#n(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#f(t.storage),this.#e.delete(t.texture))}#h(t){let e=this.#t[t];e&&this.#f(e),this.#t[t]=null,this.held[t]=0}pump(t,e){let r=!1,s=[...this.#e.values()];s.sort((o,i)=>this.#a(i.texture)-this.#a(o.texture));for(let o of s){for(;!e()&&this.#m(o,t);)r=!0;if(e())break}return r&&this.#i(),r}#m(t,e){let{texture:r,to:s,images:o,loss:i}=t,n=this.held[r],{offsets:a}=this.rows[r];if(!o||this.#e.get(r)!==t)return!1;let c=this.#s[r],u=s===n&&i<this.loss[r];if(c===0||s>c||s<=n&&c>=n&&!u)return this.#n(t),!1;t.storage||(t.inside=u,t.storage=u?this.#t[r]:this.#p(r,s));let{storage:f}=t;if(!f||t.inside&&f!==this.#t[r])return f&&this.#n(t),!1;let{level:p,row:m}=t,{data:y,height:w}=o[p];return t.row=f.upload(p,y,m,a[p]),t.row>=w&&(t.row=0,t.level++),t.level<s||(this.#e.delete(r),this.loss[r]=i,t.inside)||(this.#h(r),this.#t[r]=f,this.held[r]=s,this.fades&&n>0&&s>n&&f.fadeIn(s-n,e)),!0}#p(t,e){let{sizes:r,channels:s}=this.rows[t],o=this.#c(t,e),i=e<this.held[t]?0:this.#E();return this.bytes+o+i>this.budget?null:(this.bytes+=o,this.peak=Math.max(this.peak,this.bytes),new _(this.gl,r.slice(0,e),s))}#c(t,e){let{sizes:r,channels:s}=this.rows[t];return r.slice(0,e).reduce((o,i)=>o+i.width*i.height*s,0)}#E(){return this.#s.reduce((t,e,r)=>e<this.held[r]?Math.max(t,this.#c(r,e)):t,0)}#f(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#n(t);for(let t=0;t<this.rows.length;t++)this.#h(t)}lose(){this.#r=this.held.map((t,e)=>Math.max(t,this.#r[e])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};function Y(h,t){let e=0,r=0;for(let o of t)e+=Math.max(o.left,0),r+=+!o.waits;let s=h.latency+.2/2;return r<h.concurrency&&(e===0||8*e<s*h.bandwidth)}var V=class{constructor(t){let{gl:e,rows:r,stream:s,index:o}=t;this.walk=t,this.memory=new M(e,r,(a,c)=>s.decode(a,c)),this.memory.fades=!1,this.renderer=new N(e,this.memory,o.textures);let{light:i,statues:n}=t.picture.renderer;i?.illuminate(this.renderer),this.renderer.statues=n}settle(){let{walk:t,memory:e}=this,{client:r,client:{catalogue:s},needs:{present:o},stream:{estimate:i}}=t,{T:n,K:a,levels:c,stored:u,ends:f,previews:{first:p,column:m,loss:y}}=s;if(!o)return!1;let w=new Int32Array(n),v=new Float64Array(n),S=new Float64Array(n),{downloads:A}=r,b=Math.max(8e3,.2*i.bandwidth/8),T=[];for(let l=0;l<n;l++){v[l]=o[l*a+1];let x=c[l],g=-1;for(;x>0&&!(o[l*a+x]>0);)x--;w[l]=Math.min(x,A.reach(l).last),S[l]=A.loss(l,w[l]);for(let d=p[l];x>u[l]&&d<p[l+1];d++)m[d]>=x&&(g<0||y[d]<y[g])&&(g=d);let E=g<0?0:y[g];(e.held[l]<x||x>0&&e.loss[l]>E)&&T.push({texture:l,end:f[l*a+x],preview:g})}e.settle(w,v,S),T.sort((l,x)=>v[x.texture]-v[l.texture]);for(let{texture:l,end:x,preview:g}of T){if(!Y(i,A.waiting))break;if(g>=0){A.free("preview",g)&&t.stream.ask(A.ask("preview",g,v[l]));continue}let E=Math.min(x,Math.floor(A.bytes[l]+b));E<=A.bytes[l]||!A.free("texture",l)||t.stream.ask(A.ask("texture",l,v[l],E))}return T.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{V as Comparison};

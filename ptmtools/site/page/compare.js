function V({texture:h,factor:t,blends:s,cutoff:i,twoSided:e,extras:r}){return[h,t,s,i,e,r].join()}function*U(h){let t=new Map;for(let p of h){let x=V(p),E=t.get(x);E?E.push(p):t.set(x,[p])}let s=h.reduce((p,{positions:x})=>p+x.length/3,0),i=h.reduce((p,{indices:x})=>p+x.length,0),e=h.some(({spots:p})=>p),r=h.some(({colors:p})=>p),o=5+2*+e+ +r,n=new Float32Array(o*s),a=new Uint8Array(n.buffer),l=s>65535?new Uint32Array(i):new Uint16Array(i),m=[],f=0,y=0;for(let p of t.values()){let x=y;for(let{positions:w,uvs:g,colors:b,spots:A,indices:c}of p){yield;for(let d=0;d<c.length;d++)d%16384===16383&&(yield),l[y++]=f+c[d];for(let d=0;d<w.length/3;d++,f++){d%16384===16383&&(yield);for(let u=0;u<3;u++)n[o*f+u]=w[3*d+u];for(let u=0;r&&u<4;u++)a[4*(o*(f+1)-1)+u]=b?255*F(b[4*d+u]/65535)+.5:255;for(let u=0;u<2;u++)g&&(n[o*f+3+u]=g[2*d+u]),A&&(n[o*f+5+u]=A[2*d+u])}}let[E]=p,v=[...E.factor.slice(0,3).map(F),E.factor[3]];for(let w=x;w<y;w+=6144){let g=l.subarray(w,Math.min(w+6144,y)),b=Y(g,n,o);m.push({look:E,first:w*l.BYTES_PER_ELEMENT,count:g.length,color:v,...b}),yield}}return{data:n,lit:e,painted:r,index:l,batches:m}}function Y(h,t,s){let i=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let r=0;r<h.length;r++)for(let o=0,n=s*h[r];o<3;o++,n++)t[n]<i[o]&&(i[o]=t[n]),t[n]>e[o]&&(e[o]=t[n]);return{low:i,high:e}}var R=class{constructor(t,{data:s,lit:i,painted:e,index:r,batches:o},n){this.gl=t,this.shapes=n,this.batches=o,this.bytes=s.byteLength+r.byteLength,this.type=r instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,s,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,r,t.STATIC_DRAW);let a=i?28:20,l=a+4*+e,m=(f,y,p)=>{t.enableVertexAttribArray(f),t.vertexAttribPointer(f,y,y<4?t.FLOAT:t.UNSIGNED_BYTE,y>3,l,p)};m(0,3,0),m(1,2,12),t.vertexAttrib4f(2,1,1,1,1),e&&m(2,4,a),i&&m(3,2,20),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}};function F(h){return h<=.0031308?12.92*h:1.055*h**(1/2.4)-.055}var I=(h="",t="")=>`#version 300 es
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
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${j}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
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
void main(){shown=vec4(bytes(item),0.0,1.0);}`,B={surface:[I(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),W],item:[I(),$],placeholder:[I(),q]};function L(h,t,s=B[t]){let i=h.createProgram(),e=[h.VERTEX_SHADER,h.FRAGMENT_SHADER];if(s.forEach((n,a)=>{let l=h.createShader(e[a]);h.shaderSource(l,n),h.compileShader(l),h.attachShader(i,l),h.deleteShader(l)}),h.linkProgram(i),!h.getProgramParameter(i,h.LINK_STATUS)&&!h.isContextLost())throw new Error(`${t}: ${h.getProgramInfoLog(i)}`);let r={},o=h.isContextLost()?0:h.getProgramParameter(i,h.ACTIVE_UNIFORMS);for(let n=0;n<o;n++){let a=h.getActiveUniform(i,n)?.name??"";r[a]=h.getUniformLocation(i,a)}return{program:i,at:r}}function P(h,{program:t,at:s},i){h.useProgram(t),h.uniform3fv(s.eye,i.eye),h.uniformMatrix3fv(s.turn,!1,i.turn),h.uniform4fv(s.lens,i.lens)}var O=[.16,.17,.19,1],_=class{cells=new Map;#t=new Map;constructor(t,s,i){this.gl=t,this.memory=s,this.means=i.map(({color:e})=>e.map(r=>r/255)),this.surface=L(t,"surface"),this.baked=i.some(e=>"light"in e),this.statues=null}add(t,s,i){let e=this.#t.get(t)??{shapes:s,steps:U(s)};this.#t.set(t,e);let{steps:r}=e,o=r.next();for(;!o.done;){if(i())return!1;o=r.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new R(this.gl,o.value,e.shapes)),!0}keep(t){for(let[s,i]of this.cells)t.has(s)||(i.delete(),this.cells.delete(s));for(let s of this.#t.keys())t.has(s)||this.#t.delete(s)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:s}of this.cells.values())t+=s;return t}draw(t,s,i){let{gl:e,surface:r}=this;e.clearColor(O[0],O[1],O[2],1),e.depthMask(!0),e.clear(e.COLOR_BUFFER_BIT|e.DEPTH_BUFFER_BIT),e.enable(e.DEPTH_TEST),e.disable(e.BLEND),P(e,r,t);let o=!1,n=[],a=[];for(let{buffers:l,batches:m}of s){e.bindVertexArray(l.vertexArray);for(let f of m)f.look.blends?n.push({buffers:l,batch:f,far:J(t.eye,f)}):this.statues?.has(f.look)?a.push({buffers:l,batch:f}):o=this.#e(l,f,i)||o}if(a.length){let l=(m,f)=>this.#s(m,f,i);o=this.statues?.draw(t,a,l,i)||o,e.useProgram(r.program)}if(n.length){e.enable(e.BLEND),e.blendFuncSeparate(e.SRC_ALPHA,e.ONE_MINUS_SRC_ALPHA,e.ONE,e.ONE_MINUS_SRC_ALPHA),e.depthMask(!1);for(let{buffers:l,batch:m}of n.sort((f,y)=>y.far-f.far))e.bindVertexArray(l.vertexArray),o=this.#e(l,m,i)||o;e.depthMask(!0)}return e.bindVertexArray(null),o}#e(t,s,i){let e=this.#s(this.surface.at,s,i);return t.draw(s),e}#s(t,s,i){let{gl:e}=this,{texture:r,light:o,clampU:n,clampV:a,cutoff:l,twoSided:m}=s.look;(m?e.disable:e.enable).call(e,e.CULL_FACE),e.uniform4fv(t.color,s.color),e.uniform1f(t.cutoff,l),e.uniform1i(t.textured,+(r>=0));let f=r<0?null:this.memory.of(r);e.uniform1i(t.channels,f?.channels??0),r>=0&&e.uniform3fv(t.mean,this.means[r]);let y=!1,p=+this.baked;if(o>=0){let x=this.memory.of(o);e.activeTexture(e.TEXTURE1),y=x?.bind(!0,!0,i)??!1,e.activeTexture(e.TEXTURE0),e.uniform1i(t.lightmap,1),p=x?-1:Math.max(this.means[o][0],.001)}return e.uniform1f(t.lit,p),f?.bind(n,a,i)||y}};function J(h,{low:t,high:s}){return Math.hypot(...h.map((i,e)=>(t[e]+s[e])/2-i))}function G(h,t,s){if(!s)return h;let i=new Uint8ClampedArray(h),e=t-+(t>1);for(let r=0;r<i.length;r+=t)for(let o=r;o<r+e;o++)i[o]+=s;return new Uint8Array(i.buffer)}var Q=262144,Z=.3;function H(h,t){return t===1?{inside:h.R8,outside:h.RED}:t===2?{inside:h.RG8,outside:h.RG}:{inside:h.RGBA8,outside:h.RGBA}}var S=class{#t=0;#e=0;#s=-1;constructor(t,s,i){this.gl=t,this.sizes=s,this.channels=i,this.texture=t.createTexture(),this.bytes=s.reduce((o,{width:n,height:a})=>o+n*a*i,0);let{width:e,height:r}=s[s.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,s.length,H(t,i).inside,e,r),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,s,i,e){let{gl:r,channels:o}=this,{width:n,height:a}=this.sizes[t],l=Math.min(a-i,Math.max(1,Math.floor(Q/(n*o)))),m=s.subarray(i*n*o,(i+l)*n*o);return r.bindTexture(r.TEXTURE_2D,this.texture),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.texSubImage2D(r.TEXTURE_2D,this.levels-1-t,0,i,n,l,H(r,o).outside,r.UNSIGNED_BYTE,G(m,o,e)),i+l}fadeIn(t,s){this.#t=t,this.#e=s}bind(t,s,i){let{gl:e}=this,r=+t+2*+s;if(e.bindTexture(e.TEXTURE_2D,this.texture),r!==this.#s){let[n,a]=[t,s].map(l=>l?e.CLAMP_TO_EDGE:e.REPEAT);e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_S,n),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_T,a),this.#s=r}if(!this.#t)return!1;let o=this.#t*Math.max(0,1-(i-this.#e)/Z);return e.texParameterf(e.TEXTURE_2D,e.TEXTURE_MIN_LOD,o>0?o:-1e3),o===0&&(this.#t=0),o>0}delete(){this.gl.deleteTexture(this.texture)}};var tt=3,et=6,k=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,s){this.texture=t,this.to=s,this.inside=!1}},N=class{#t;#e=new Map;#s=new Int32Array(0);#f=new Float64Array(0);#r;#i;constructor(t,s,i){this.gl=t,this.rows=s,this.decode=i,this.#t=s.map(()=>null),this.held=new Int32Array(s.length),this.loss=new Float64Array(s.length),this.#r=new Float64Array(s.length),this.#i=new Int32Array(s.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,s,i){this.#s=t,this.#r=i,this.#i.fill(0),this.#f=s;for(let n=0;n<t.length;n++)t[n]===0&&this.held[n]&&this.#h(n);let e=[...t.keys()].filter(n=>this.held[n]>t[n]);e.sort((n,a)=>s[n]-s[a]);let r=[...this.#e.values()].some(({storage:n,inside:a})=>n&&!a),o=Math.min(...e.map(n=>this.#l(n,t[n])));for(let n of e){if(this.bytes<=this.budget&&(r||this.bytes+o<=this.budget))break;this.#h(n)}this.#o()}hold(){this.#s=this.held.map((t,s)=>Math.max(t,Math.min(this.#s[s]??0,this.#i[s]))),this.#r=this.loss.slice()}resume(){this.#o()}#u(t,s){let i=-1;for(let e=0;e<this.rows.length;e++)t(e)&&(i<0||s(e)>s(i))&&(i=e);return i}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#r[t]<this.loss[t]}#a(t){let s=this.held[t],i=this.#s[t];return i<s?2:s===0?1:i>s?0:-1}#o(){let{held:t}=this,s=this.#s,i=this.#f;for(;;){let e=[...this.#e.values()];if(e.filter(({images:a})=>!a).length>=tt)return;let r=e.length<et,o=this.#u(a=>s[a]>0&&!this.#e.has(a)&&(s[a]<t[a]||r&&(s[a]>t[a]||this.#d(a))),a=>i[a]+this.#a(a));if(o<0)return;let n=new k(o,s[o]);this.#e.set(o,n),this.decode(o,s[o]).then(({images:a,loss:l})=>{Object.assign(n,{images:a,loss:l}),this.#o()},()=>this.#n(n))}}#n(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#c(t.storage),this.#e.delete(t.texture))}#h(t){let s=this.#t[t];s&&this.#c(s),this.#t[t]=null,this.held[t]=0}pump(t,s){let i=!1,e=[...this.#e.values()];e.sort((r,o)=>this.#a(o.texture)-this.#a(r.texture));for(let r of e){for(;!s()&&this.#m(r,t);)i=!0;if(s())break}return i&&this.#o(),i}#m(t,s){let{texture:i,to:e,images:r,loss:o}=t,n=this.held[i],{offsets:a}=this.rows[i];if(!r||this.#e.get(i)!==t)return!1;let l=this.#s[i],m=e===n&&o<this.loss[i];if(l===0||e>l||e<=n&&l>=n&&!m)return this.#n(t),!1;t.storage||(t.inside=m,t.storage=m?this.#t[i]:this.#p(i,e));let{storage:f}=t;if(!f||t.inside&&f!==this.#t[i])return f&&this.#n(t),!1;let{level:y,row:p}=t,{data:x,height:E}=r[y];return t.row=f.upload(y,x,p,a[y]),t.row>=E&&(t.row=0,t.level++),t.level<e||(this.#e.delete(i),this.loss[i]=o,t.inside)||(this.#h(i),this.#t[i]=f,this.held[i]=e,this.fades&&n>0&&e>n&&f.fadeIn(e-n,s)),!0}#p(t,s){let{sizes:i,channels:e}=this.rows[t],r=this.#l(t,s),o=s<this.held[t]?0:this.#y();return this.bytes+r+o>this.budget?null:(this.bytes+=r,this.peak=Math.max(this.peak,this.bytes),new S(this.gl,i.slice(0,s),e))}#l(t,s){let{sizes:i,channels:e}=this.rows[t];return i.slice(0,s).reduce((r,o)=>r+o.width*o.height*e,0)}#y(){return this.#s.reduce((t,s,i)=>s<this.held[i]?Math.max(t,this.#l(i,s)):t,0)}#c(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#n(t);for(let t=0;t<this.rows.length;t++)this.#h(t)}lose(){this.#i=this.held.map((t,s)=>Math.max(t,this.#i[s])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};var D=.2,X=8e3,Pt=2**20;function K(h,t){let s=0,i=0;for(let r of t)s+=Math.max(r.left,0),i+=+!r.waits;let e=h.latency+D/2;return i<h.concurrency&&(s===0||8*s<e*h.bandwidth)}var z=class{constructor(t){let{gl:s,rows:i,stream:e,index:r}=t;this.walk=t,this.memory=new N(s,i,(o,n)=>e.decode(o,n)),this.memory.fades=!1,this.renderer=new _(s,this.memory,r.textures),this.renderer.statues=t.renderer?.statues??null}settle(){let{walk:t,memory:s}=this,{client:i,catalogue:e,present:r,estimate:o}=t,{T:n,K:a,levels:l,stored:m,ends:f,previews:{first:y,column:p,loss:x}}=e;if(!r)return!1;let E=new Int32Array(n),v=new Float64Array(n),w=new Float64Array(n),{downloads:g}=i,b=Math.max(X,D*o.bandwidth/8),A=[];for(let c=0;c<n;c++){v[c]=r[c*a+1];let d=l[c],u=-1;for(;d>0&&!(r[c*a+d]>0);)d--;E[c]=Math.min(d,g.reach(c).last),w[c]=g.loss(c,E[c]);for(let T=y[c];d>m[c]&&T<y[c+1];T++)p[T]>=d&&(u<0||x[T]<x[u])&&(u=T);let M=u<0?0:x[u];(s.held[c]<d||d>0&&s.loss[c]>M)&&A.push({texture:c,end:f[c*a+d],preview:u})}s.settle(E,v,w),A.sort((c,d)=>v[d.texture]-v[c.texture]);for(let{texture:c,end:d,preview:u}of A){if(!K(o,g.waiting))break;if(u>=0){g.free("preview",u)&&t.stream.ask(g.ask("preview",u,v[c]));continue}let M=Math.min(d,Math.floor(g.bytes[c]+b));M<=g.bytes[c]||!g.free("texture",c)||t.stream.ask(g.ask("texture",c,v[c],M))}return A.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{z as Comparison};

var g=`
vec3 linear(vec3 color){
return mix(pow((color+0.055)/1.055,vec3(2.4)),color/12.92,lessThanEqual(color,vec3(0.04045)));
}`,v=(s="0.8")=>`
vec3 developed(vec3 light){
float most=max(light.r,max(light.g,light.b));
if(most > ${s}){
float peak=1.0-0.04/(most-0.6);
light=mix(light*(peak/most),vec3(peak),1.0-1.0/(0.15*(most-peak)+1.0));
}
light=min(light,1.0);
return mix(1.055*pow(light,vec3(1.0/2.4))-0.055,12.92*light,lessThanEqual(light,vec3(0.0031308)));
}`,d=`
layout(location=3)in vec2 place2;
out vec2 spot;
uniform float white;
void main(){
spot=place2;`,x=({stops:s,tone:e})=>`
in vec2 spot;
uniform float white;
uniform sampler2D lightmap;
uniform vec3 code;
${g}
${v(e==="plain"?"1e30":void 0)}
vec3 display(vec3 texel){
if(white==0.0)return texel*color.rgb*painted;
vec3 share=code.r < 0.0?texture(lightmap,spot).rgb:code;
return developed(linear(texel)*color.rgb*painted*white*exp2(float(${s})*(share-1.0)));
}
void main`,w=`#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1)*4.0-1.0;
way=inverse(turn)*vec3(corner/lens.xy,-1.0);
gl_Position=vec4(corner,1.0,1.0);
}`,E=`#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${v()}
void main(){
shown=vec4(developed(mix(ground,sky,smoothstep(-0.02,0.02,normalize(way).y))),1.0);
}`,m=class{exposure=1;#t=[];#i=0;#e=!0;#o=null;constructor(e){this.row=e}sources([e,i]){if(!i.includes("painted"))return[e,i];let o=i.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/,"display(sampled.rgb)");return[e.replace(/void main\(\) ?{/,d).replace(/painted ?= ?paint\.rgb/,"painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),o.replace("void main",x(this.row)).replace(/glow ?= ?0\.25/,"glow = white > 0.0 ? 1.0 : 0.7")]}illuminate(e){e.light=this,e.gl.deleteProgram(e.surface.program),e.surface=e.compile("surface")}adapt({cell:e,client:{known:i},index:{cells:o},memory:{fades:t},picture:u},n,l){let{exposure:r,row:{tone:c}}=this,p=e<0||c==="plain"?r:o[e].exposure??1;this.#e||=!(Math.hypot(...n.map((h,f)=>h-this.#t[f]))<1);let a=this.#e||!t?1:(r/p)**Math.exp((this.#i-l)/.2);this.exposure=Math.abs(Math.log(a))<.01?p:p*a,this.#e&&=!i[e],this.#i=l,this.#t=[...n],this.exposure!==r&&u.touch()}paint({gl:e,memory:i,means:o},t,{white:u,light:n},l){e.uniform1f(t.white,u*this.exposure);let r=n<0?null:i.of(n);if(e.uniform3fv(t.code,r?[-1,-1,-1]:o[n]??[1,1,1]),!r)return!1;e.activeTexture(e.TEXTURE1);let c=r.bind(!0,!0,l);return e.activeTexture(e.TEXTURE0),e.uniform1i(t.lightmap,1),c}surround(e,{turn:i,lens:o}){let{gl:t,surface:u}=e,{row:{tone:n,sky:l=[],ground:r=[]},exposure:c}=this;if(n==="plain")return;let{program:p,at:a}=this.#o??=e.compile("surroundings",[w,E]);t.useProgram(p),t.uniformMatrix3fv(a.turn,!1,i),t.uniform4fv(a.lens,o),t.uniform3fv(a.sky,l.map(h=>h*c)),t.uniform3fv(a.ground,r.map(h=>h*c)),t.bindVertexArray(null),t.depthFunc(t.LEQUAL),t.drawArrays(t.TRIANGLES,0,3),t.depthFunc(t.LESS),t.useProgram(u.program)}};function y({comparison:s,index:e,picture:{renderer:i}}){if(!e.light)return;let o=new m(e.light);o.illuminate(i),s&&o.illuminate(s.renderer)}export{m as Light,y as show};
